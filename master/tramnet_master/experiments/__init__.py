"""One module a published experiment, with its presets."""
