"""Engines: what work comes next, and what its outcome means. They know no network."""
