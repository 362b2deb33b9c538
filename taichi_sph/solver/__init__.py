"""The algorithm: step, stable time step, rupture, energy ledger, watchdog, and the simulation that owns them."""
