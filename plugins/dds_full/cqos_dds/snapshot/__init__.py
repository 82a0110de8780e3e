"""``cqos snapshot dds``: what runs in a domain, as a system file.

`discovery` asks Cyclone DDS what it has found, `ros_nodes` reads what ROS 2 tells of its nodes, `seen` is what both answer,
`ros` knows how ROS 2 names things on the wire, `observed` makes a system of it, and `command` is the command.
"""
