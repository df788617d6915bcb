-- Where radio is banned, a walk's markers and faults are keyed in at a kiosk, and its logs come in the evening: two clocks, tied here.

-- How the clock by which a walk's markers were keyed in stands to that of its logs.
create table clock_ties (
    session_id  text    not null primary key references sessions (id) on delete cascade,
    state       text    not null,   -- 'same', 'tied', 'ambiguous', 'unmatched', 'too_few', or 'given' by somebody
    offset_s    real    not null,   -- the log's time less the keyed one, s; 0 where it is not known
    sigma_s     real,               -- its sigma, s; null where it was not measured
    keyed       integer not null,   -- visits that were keyed in
    matched     integer not null,   -- of these, those that fall on a stand of the log where the track agrees
    tied_at     integer not null    -- UTC µs
) strict, without rowid;

-- What was added to a keyed visit's times to have the log's, ns; without it they are as they were keyed in.
alter table visits add column keyed_shift_ns integer not null default 0;

-- Left out of the statistics of markers.
alter table sessions add column excluded integer not null default 0;

-- Whether a session's start was given. One that nobody gave was stored as the site's origin, where hardly anybody ever starts.
alter table sessions add column start_known integer not null default 0;
update sessions set start_known = 1
    where start_marker is not null or start_e_m <> 0 or start_n_m <> 0 or start_u_m <> 0;

-- A fault that is placed again, as by its walk's track, keeps its former place in its history. Nothing is written again: the check is
-- changed in the schema's own text.
pragma writable_schema = on;
update sqlite_schema set sql = replace(sql, '''photo'', ''comment'')', '''photo'', ''comment'', ''place'')')
    where type = 'table' and name = 'fault_changes';
pragma writable_schema = reset;
