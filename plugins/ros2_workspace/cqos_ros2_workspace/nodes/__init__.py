"""What is known of nodes: files `*.node.yaml` with endpoints, parameters and plugins of the nodes of a package."""
