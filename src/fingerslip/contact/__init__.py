"""Contact of a deformable body with rigid counterfaces: shapes, friction laws, candidates, and the contact law."""
