"""``cqos snapshot dds``: a running domain as a system file.

`discovery` asks Cyclone DDS for its findings, `ros_nodes` reads the announcements of ROS 2 nodes. Both answer with values of `seen`.
`ros` has the names of ROS 2 on the wire, `observed` makes a system, and `command` is the command.
"""
