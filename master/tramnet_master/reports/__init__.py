"""Figures and tables, made from the files of a run folder alone; the only rooms that know matplotlib."""
