"""Tools that watch the traffic of a running network."""
