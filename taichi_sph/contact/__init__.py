"""Contact of bodies by pinballs and multipliers (T 3.3)."""
