"""What networks are worth that take posed views: on sets of objects, disturbed, on photographs."""
