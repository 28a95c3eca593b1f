"""The paper's tables and figures, measured here; the paper's own figures stand beside ours."""
