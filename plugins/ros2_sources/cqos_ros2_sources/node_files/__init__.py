"""Node files from the results of walks, and from files of other tools."""
