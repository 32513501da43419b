"""The shipped mechanisms, one TOML file each."""
