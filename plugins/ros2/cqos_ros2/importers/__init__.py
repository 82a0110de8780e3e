"""Importers of the files that ROS 2 people already have: what runs, what was recorded, and what is configured."""
