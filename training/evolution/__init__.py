"""Evolution: AFPO, its operators, objectives and word sets, and one resumable run of it."""
