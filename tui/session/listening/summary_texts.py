"""Texts of the summary of a monitored line; those with a count are for one and for several."""

from __future__ import annotations

HEARD_NONE_TEXT = "Listened {seconds:.1f} s: no exchange."
LISTENED_TEXTS = (
    "Listened {seconds:.1f} s: 1 exchange, {pace:.1f} a second.",
    "Listened {seconds:.1f} s: {count} exchanges, {pace:.1f} a second.",
)
NO_FRAME_TEXTS = (
    "1 byte received, but no whole frame. Check the baud rate and the format.",
    "{count} bytes received, but no whole frame. Check the baud rate and the format.",
)
POLLED_OFTEN_TEXT = "polled {pace:.1f} times a second, longest pause {longest:.2f} s"
POLLED_SELDOM_TEXT = "polled every {cycle:.1f} s, longest pause {longest:.2f} s"
REFUSED_TIMES_TEXTS = (
    "refused once with exception {code}: {meaning}.",
    "refused {count} times with exception {code}: {meaning}.",
)
DAMAGED_TEXTS = (
    "damaged answer once: noise, or several devices with the address {device}",
    "damaged answer {count} times: noise, or several devices with the address {device}",
)
UNASKED_TEXTS = ("1 answer without a request", "{count} answers without a request")
TWO_ANSWERS_TEXTS = (
    "TWO ANSWERS to 1 request: do two devices have the address {device}?",
    "TWO ANSWERS to {count} requests: do two devices have the address {device}?",
)
READS_NOW_TEXTS = (
    "the master reads {codes} in 1 request, {milliseconds:.1f} ms.",
    "the master reads {codes} in {count} requests, {milliseconds:.1f} ms.",
)
WOULD_TAKE_TEXTS = (
    "1 request would take {milliseconds:.1f} ms: {reads}",
    "{count} requests would take {milliseconds:.1f} ms: {reads}",
)
OUTSIDE_TEXTS = (
    "Bytes outside frames: {bytes}, in 1 place (noise, collisions, cut frames).",
    "Bytes outside frames: {bytes}, in {count} places (noise, collisions, cut frames).",
)
SECOND_MASTER_TEXTS = (
    "A SECOND MASTER? 1 request began while another request still waited for its answer.",
    "A SECOND MASTER? {count} requests began while another request still waited for its answer.",
)
BROKEN_TEXTS = (
    "Broken frames: 1 frame with an internal pause of up to {pause:.1f} ms. Strict drives ignore"
    " such frames.",
    "Broken frames: {count} frames with an internal pause of up to {pause:.1f} ms. Strict drives"
    " ignore such frames.",
)
TOO_SOON_TEXTS = (
    "Broken gaps: 1 frame began too soon after another.",
    "Broken gaps: {count} frames began too soon after another.",
)

COMMANDED_TEXTS = {
    (False, False): "read only: the master on this line does not command it",
    (True, False): "commanded by the master: {commands}",
    (False, True): "written: {others}",
    (True, True): "commanded by the master: {commands}; written: {others}",
}
"""By whether the master has written commands and other words."""
