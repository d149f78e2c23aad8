"""tiltprint: the user's machine, material and process profiles: TOML files read into validated, frozen models."""
