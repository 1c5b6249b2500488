"""The parameters of the papers, as files."""
