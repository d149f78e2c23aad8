"""Plans: a decomposition as a file that a person can read, change and use again."""
