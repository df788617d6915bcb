-- What an instrument is like, for systems that need to be told (`docs/wire.md`): lever arms, joints, stations.
alter table sessions add column instrument text; -- TOML, as the system documents it; null where the system takes none
