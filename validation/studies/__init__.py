"""The studies: each lists tasks, plays them, gathers a finding (see
`rockcheck.validation.study`)."""
