"""Serving: pages for this computer alone, by an address that holds a token. Public: `guard.guarded`, `browser.lead_browser`,
`watch_page.serve_watch_page`."""
