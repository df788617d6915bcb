-- Other programs that want to hear of faults and anomalies, and what is on its way to them; and what staff say of walks.

create table webhooks (
    id             text    not null primary key,
    name           text    not null,              -- what it is for, as it is shown
    url            text    not null,              -- http or https; where the events are posted to
    secret         text    not null,              -- the bodies are signed with it, so it is kept as it is; shown once
    events         text    not null,              -- JSON list of words such as fault.reported
    enabled        integer not null default 1,    -- 0: nothing is sent; what waits goes on waiting
    disabled_why   text,                          -- in a sentence, where it was switched off because nothing arrived; null otherwise
    failing_since  integer,                       -- UTC µs of the first try that failed since one that did not; null while all is well
    version        integer not null default 1,    -- counts its changes: who changes it names the one that was seen
    created_at     integer not null,              -- UTC µs
    created_by     text,                          -- who; null where nobody had to sign in
    updated_at     integer not null               -- UTC µs of the last change
) strict;

-- The outbox, written in the transaction of the event: one row for each webhook that wants it.
create table webhook_deliveries (
    id           integer not null primary key autoincrement,  -- in the order of the events
    webhook_id   text    not null references webhooks (id) on delete cascade,
    event_id     text    not null,              -- the same for every webhook and every try: who gets it twice knows it
    event        text    not null,              -- such as fault.reported
    body         text    not null,              -- JSON, as it is signed and sent
    state        text    not null check (state in ('waiting', 'delivered', 'failed')),
    tries        integer not null default 0,
    next_at      integer,                       -- UTC µs of the next try; null when there is none
    tried_at     integer,                       -- UTC µs of the last try; null before the first
    took_ms      integer,                       -- how long that took
    status       integer,                       -- HTTP status of its answer; null where there was none
    answer       text,                          -- the first bytes of its answer, or why there was none
    created_at   integer not null               -- UTC µs
) strict;
create index webhook_deliveries_due on webhook_deliveries (next_at) where state = 'waiting';
create index webhook_deliveries_by_webhook on webhook_deliveries (webhook_id, id);

-- What staff say of a walk, and how much it takes: walks are looked for by both.
alter table sessions add column starred integer not null default 0;        -- 1: somebody marked it
alter table sessions add column note text not null default '';            -- what somebody wrote of it
alter table sessions add column noted_by text;                             -- who marked it or wrote that; null: nobody
alter table sessions add column noted_at integer;                          -- UTC µs; null likewise
alter table sessions add column stored_bytes integer not null default 0;   -- its samples, packed, as they were when they were accepted or the walk was finished
update sessions set stored_bytes =
    (select coalesce(sum(length(body)), 0) from raw_chunks where raw_chunks.session_id = sessions.id);
create index sessions_by_start on sessions (started_at);
