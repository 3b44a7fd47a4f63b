"""The studies: each lists tasks, plays them, gathers a finding (`rockcheck.validation.study`)."""
