-- How a log was read: in which format, and what was said of it; and mappings of columns that people keep.

alter table logs add column format text;     -- as the engine names it (canonical, x_io, …); null until it was read, and for logs from before
alter table logs add column reading text;    -- JSON of what was said of it (mapping, rate_hz, field_ut_per_count, clock_zero_ns); null: nothing

-- Which column of a table is which channel, in which unit, under a name.
create table mappings (
    id          text    not null primary key,
    name        text    not null unique,     -- as it is shown
    mapping     text    not null,            -- JSON, as reading.mapping
    created_at  integer not null,            -- UTC µs
    updated_at  integer not null             -- UTC µs
) strict;
