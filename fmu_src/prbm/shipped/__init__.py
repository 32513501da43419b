"""The shipped mechanisms, one TOML file per mechanism."""
