"""The study: runs by the hundred, their provenance, rescoring and store. On `evolution`."""
