"""How far two histories differ: measures, `compare`, closed forms, measured histories."""
