"""The run of `estimate`: the plan, one task a frame, the result and its record, resuming."""
