"""The commands of `rockcheck`: `cli` finds and runs them; each is a function of a module here."""
