"""Everything that decides: engines, the farm, experiments, reports and the command line."""
