"""What a run leaves behind: frames, histories, checkpoints, record, summary, answer. No Taichi, no VTK."""
