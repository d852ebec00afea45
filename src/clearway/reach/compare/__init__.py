"""The paper's comparison of methods with the full reach set; no flight needs it."""
