"""Matching of endpoints on topics and over bridges, and evaluation of rules over profiles, without names.

`topic_groups.group` makes groups of equal endpoints, `peer_values.settle` takes values from peers, `judge` asks rules of profiles,
`topic_outcomes` those of a topic, `pair_outcomes` those of a topic with one endpoint on each side.
"""
