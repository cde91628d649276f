"""CSS of the page's layout: panels are beside the scene, on a phone below it.

The selectors are those of viser 1; `tests/pose_view/graph/test_browser.py` checks the result.
"""

BAR = "3rem"  # height of the slider's bar
SHEET = 40  # [%] largest share of a phone's page for the panels

SLIDER_STYLE = f"""<style>
#root {{ height: calc(100% - {BAR}) !important; }}
div[style*="padding-inline"]:has(> .mantine-Flex-root .mantine-Slider-root) {{
  position: fixed; inset: auto 0 0 0; height: {BAR}; z-index: 30; padding: 0 1rem !important;
  display: grid; align-items: center; background: var(--mantine-color-body);
  border-top: 1px solid var(--mantine-color-gray-3);
}}
@media (max-width: 36em) {{
  .mantine-Paper-root[style*="bottom: 0px"] {{ bottom: {BAR} !important; }}
  #root div:has(> canvas) {{ height: calc({100 - SHEET}dvh - {BAR}) !important; }}
}}
</style>"""
"""Slider of a recording's time in a bar at the bottom, as wide as the page."""

PHONE_STYLE = f"""<style>
@media (max-width: 36em) {{
  .mantine-Paper-root[style*="bottom: 0px"] {{
    width: 100% !important; max-height: {SHEET}dvh !important;
  }}
  .mantine-Paper-root[style*="bottom: 0px"] .mantine-ScrollArea-content > div {{
    width: 100% !important;
  }}
  #root div:has(> canvas) {{ height: {100 - SHEET}dvh; }}
}}
</style>"""
"""On a phone, the scene is above the panels, not behind them."""
