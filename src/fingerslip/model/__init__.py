"""The model: all that a simulation needs, as data.

``model`` has contacts, supports, loads and what is recorded; ``programme`` says how counterfaces move, ``timing`` how
time passes, ``rigid_bodies`` which bodies carry counterfaces.
"""
