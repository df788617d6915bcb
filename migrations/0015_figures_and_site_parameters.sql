-- Figures beside sentences, and the parameters that a site computes its walks with.

-- The figures of `detail`, JSON by name, the unit at its end; null for what was found before they were kept.
alter table anomalies add column figures text;

-- What walks are computed with. Rows are only added, and the newest holds; before the first, every parameter is the default.
create table site_parameters (
    id           integer not null primary key autoincrement,
    set_id       text,              -- the set that was made the site's; no foreign key, for it may be removed; null: back to the defaults
    set_name     text,              -- its name at that time
    set_version  integer,           -- its version at that time
    parameters   text    not null,  -- JSON as in parameter_sets: as they were at that time
    chosen_at    integer not null,  -- UTC µs
    chosen_by    text               -- who; null where nobody had to sign in
) strict;

-- What a session's stream is computed with for as long as it goes on, so that a server that is started again makes the same
-- of it; null: the defaults. A job takes what holds when it runs.
alter table sessions add column site_parameters_id integer references site_parameters (id);
