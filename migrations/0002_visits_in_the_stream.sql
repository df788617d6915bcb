-- Visits that a device told while it streamed: at which point of the stream, and what the marker's
-- coordinates were then. A live session that is rebuilt after a restart replays samples and visits in
-- the order in which they came, and so arrives at the very state that was lost.

create table stream_visits (
    visit_id       text    not null primary key references visits (id) on delete cascade,
    session_id     text    not null references sessions (id) on delete cascade,
    after_samples  integer not null,   -- samples of the stream, both feet, that had been taken before it
    e_m            real    not null,   -- the marker's coordinates at that time
    n_m            real    not null,
    u_m            real                -- null: its height was not surveyed
) strict;
create index stream_visits_by_session on stream_visits (session_id, after_samples);
