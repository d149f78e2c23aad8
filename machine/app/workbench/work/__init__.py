"""The long work of the workbench, done in processes of its own."""
