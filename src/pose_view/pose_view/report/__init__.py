"""The report of a recording: tables and figures on one HTML page.

``recording`` reads a bag and runs the estimators over it, ``analysis`` computes the figures,
``tables`` and ``figures`` present them, ``page`` renders the page, ``csv_files`` formats the
numbers.
"""
