-- Results in pieces, runs of anomalies, jobs that are set aside, and checksums (`docs/durability.md`). Nothing that is large is written
-- again: columns are added, and the check on a track's run is taken out of the schema's own text, as in 0018.

-- A new result is written beside the one that is shown, in pieces, and takes its place in one short step: the runs of one are
-- called `main`, `filtered` and `without_markers`, those of the other `main~` and so on.
alter table sessions add column shown_result text not null default ''; -- what the names of the runs that are shown end with: '' or '~'
-- A session that was removed is seen by nobody from then on; its rows go in pieces, and itself with the last.
alter table sessions add column removed_at integer; -- UTC µs; null while it is there
create index sessions_removed on sessions (removed_at) where removed_at is not null;
-- CRC-32 of a row's session, run and values, as store/track.rs lays them out; null for what was written before.
alter table track_points add column checksum integer;
pragma writable_schema = on;
update sqlite_schema set sql = replace(sql, ' check (run in (''main'', ''filtered'', ''without_markers''))', '')
    where type = 'table' and name = 'track_points';
pragma writable_schema = reset;

-- Many of a kind are told as runs of them: the row is the first, with the time of all.
alter table anomalies add column times integer not null default 1; -- how many were gathered into this row

-- A job under which the server died twice is set aside.
alter table jobs add column tries integer not null default 0; -- how often it was begun and neither ended nor was asked to stop

-- CRC-32 of a chunk's session, place and bytes, as store/checksum.rs lays them out; null for what was written before.
alter table raw_chunks add column checksum integer;
alter table stream_chunks add column checksum integer;
-- The same of the packed points of a lab run, and of what a chart is drawn from.
alter table lab_tracks add column checksum integer;
alter table session_charts add column checksum integer;

-- Who made a mapping may change it.
alter table mappings add column created_by text references accounts (id) on delete set null; -- null: nobody that is known

-- What hangs on a session is found without reading all samples there are.
create index raw_chunks_by_session on raw_chunks (session_id);
