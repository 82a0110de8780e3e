"""Who matches whom on a topic, over bridges too, and what the rules of a pack say of their profiles, without names.

`pairing.group` makes groups of equal endpoints, `peer_values.settle` takes values from peers, `judge` and `topic_shape` ask the rules.
"""
