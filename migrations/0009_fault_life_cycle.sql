-- A fault's way from its report to the check of its repair, who took each step and why, who is to go, and photos.
-- SQLite changes no check in place, so the table is written anew; what was closed counts as verified.

create table faults_with_life_cycle (
    id                text    not null primary key,
    inspector_id      text    not null references inspectors (id),
    session_id        text    references sessions (id) on delete set null, -- the walk it was found on, where there is one
    reported_at       integer not null,    -- UTC µs: when the inspector saw it
    t_ns              integer,             -- the same moment on the session's clock
    kind              text    not null,    -- what is wrong, a word such as hydraulic_leak
    severity          text    not null check (severity in ('low', 'medium', 'high')),
    text              text    not null default '',  -- what is to be said of it
    marker            text,                -- the actuator that was named; null when not said
    e_m               real,                -- the inspector's position at the report; null when it is not known
    n_m               real,
    u_m               real,
    sigma_e_m         real,
    sigma_n_m         real,
    sigma_u_m         real,
    covariance_en_m2  real,
    candidates        text    not null default '[]', -- JSON: [{"marker":"A17","probability":0.81,"distance_m":3.2}, …], likeliest first; marker null is "none of them"
    state             text    not null default 'open'
        check (state in ('open', 'acknowledged', 'in_work', 'fixed', 'verified')),
    assignee_id       text    references inspectors (id), -- who is to see to it; null: nobody yet
    version           integer not null default 1,  -- counts its changes: who changes it names the one that was seen
    closed_at         integer,             -- UTC µs when it was verified; null before
    created_at        integer not null,    -- UTC µs
    updated_at        integer not null     -- UTC µs of the last change
) strict;
insert into faults_with_life_cycle (
    id, inspector_id, session_id, reported_at, t_ns, kind, severity, text, marker,
    e_m, n_m, u_m, sigma_e_m, sigma_n_m, sigma_u_m, covariance_en_m2, candidates,
    state, closed_at, created_at, updated_at
) select
    id, inspector_id, session_id, reported_at, t_ns, kind, severity, text, marker,
    e_m, n_m, u_m, sigma_e_m, sigma_n_m, sigma_u_m, covariance_en_m2, candidates,
    case state when 'closed' then 'verified' else 'open' end, closed_at, created_at, coalesce(closed_at, created_at)
from faults;
drop table faults;
alter table faults_with_life_cycle rename to faults;
create index faults_by_state on faults (state, reported_at);
create index faults_by_assignee on faults (assignee_id, state);

-- The history of each fault, a row for each thing that changed. Never changed.
create table fault_changes (
    id          integer not null primary key,   -- in the order in which they were made
    fault_id    text    not null references faults (id) on delete cascade,
    changed_at  integer not null,               -- UTC µs
    changed_by  text,                           -- who; null where nobody had to sign in
    what        text    not null                -- what changed; a comment changes nothing else
        check (what in ('state', 'assignee', 'severity', 'kind', 'text', 'marker', 'photo', 'comment')),
    before      text,                           -- as a word, an id or a text; null: nothing
    after       text,                           -- the same after it
    comment     text    not null default ''     -- what was said with it
) strict;
create index fault_changes_by_fault on fault_changes (fault_id, id);

-- Photos of a fault, as they were sent. In the database, so that a backup of it is whole.
create table fault_photos (
    id            text    not null primary key,
    fault_id      text    not null references faults (id) on delete cascade,
    content_type  text    not null check (content_type in ('image/jpeg', 'image/png', 'image/webp')), -- by its first bytes
    size_bytes    integer not null,
    sha256        text    not null,             -- of the bytes, lower-case hex: the same photo is kept once
    created_at    integer not null,             -- UTC µs
    created_by    text,                         -- who; null where nobody had to sign in
    body          blob    not null,
    unique (fault_id, sha256)
) strict;
