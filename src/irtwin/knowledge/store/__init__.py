"""The store of named graphs: opened, asked, changed, looked at while another writes, kept and restored."""
