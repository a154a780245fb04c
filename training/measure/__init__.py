"""What the engines are worth: fidelity to recorded traces, evaluations a second."""
