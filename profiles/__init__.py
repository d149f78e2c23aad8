"""What the user's machine, material and process are: TOML files read into validated, frozen models."""
