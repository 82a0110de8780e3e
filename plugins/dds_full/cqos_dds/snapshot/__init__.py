"""``cqos snapshot dds``: what runs in a domain, as a system file.

`discovery` asks Cyclone DDS what it has found, `seen` is what it answers, `ros` knows how ROS 2 names things on the wire,
`observed` makes a system of it, and `command` is the command.
"""
