"""Setup: getting to know a machine: what its firmware says, where its axes are, how its joints hold."""
