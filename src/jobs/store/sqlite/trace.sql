-- A trace goes on in whatever process solves the job.
ALTER TABLE jobs ADD COLUMN traceparent TEXT; -- W3C trace context of the span that submitted it; NULL: nobody collects it
