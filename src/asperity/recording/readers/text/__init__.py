"""CSV and other tables of text: encoding, layout, headings, columns, and a line that was cut."""
