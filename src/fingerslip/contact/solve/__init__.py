"""The frictional contact problem of one step, solved on the contact nodes.

Compiled Newton for few candidates, and a working set with GMRES directions for many.
"""
