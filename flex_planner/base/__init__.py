"""Errors, validation, progress, YAML files and processes: what every package stands on."""
