"""The join: launch files, node files and parameter files of a workspace as one system."""
