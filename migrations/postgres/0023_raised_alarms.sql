-- The server itself watches for alarms: what stands, so that a restart raises nothing twice, and what stood.
create table alarms (
    key text primary key,
    kind text not null check (kind in ('lost', 'standing', 'fault')),
    session_id text,
    carrier_id text,
    fault_id text,
    since bigint not null,
    raised_at bigint not null,
    ended_at bigint
);
create index alarms_standing on alarms (key) where ended_at is null;
