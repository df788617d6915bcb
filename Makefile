# Lodestep. `make run` serves the demo, `make test` checks everything; `make help` lists the rest.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
MAKEFLAGS += --no-builtin-rules

# Where `make run` serves: `make run LISTEN=127.0.0.1:9000`.
LISTEN ?= 127.0.0.1:8080
# Where the demo keeps its data; ignored by git. Remove the folder to begin afresh.
DATA ?= data/demo
# Folders of recordings for `make docs`.
RECORDINGS ?= tests/data/*/

# Runs of `make fuzz`, cases of `make api-check`.
RUNS ?= 1000000
CASES ?= 5000

TARGET := $(or $(CARGO_TARGET_DIR),target)
RELEASE := $(TARGET)/release/lodestep
VENDORED := static/vendor/leaflet/leaflet.js
INSTALLED := static/node_modules/.package-lock.json
HAVE_NODE := $(shell command -v npm)

.PHONY: help
help: ## Lists what make can do
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: run
run: build ## Builds everything and serves the demo
	@echo
	@echo "The demo is at http://$(LISTEN)/ in a moment; Ctrl-C stops it. (Another port: make run LISTEN=127.0.0.1:9000)"
	@LODESTEP_LOG=$${LODESTEP_LOG:-warn,lodestep_server=info} exec $(RELEASE) serve --demo --data $(DATA) --listen $(LISTEN)

.PHONY: build
build: ## Builds the release binary, the pages inside
	@scripts/machine rust
	@$(if $(HAVE_NODE),$(MAKE) --no-print-directory vendor,scripts/machine node || echo "Building without the browser libraries: the map will stay empty.")
	cargo build --release --locked --bin lodestep

.PHONY: vendor
vendor: $(VENDORED) ## Brings the browser libraries from npm, by the lock file
	@:

$(INSTALLED): static/package-lock.json static/package.json
	@scripts/machine node
	cd static && npm ci --no-audit --no-fund
	@touch $@

$(VENDORED): $(INSTALLED) static/scripts/vendor.mjs
	cd static && npm run --silent vendor

.PHONY: test
test: ## Runs all checks and tests, the page in a browser included
	@scripts/machine rust
	@scripts/machine node
	@$(MAKE) --no-print-directory vendor
	@scripts/check

.PHONY: test-postgres
test-postgres: ## Runs the tests of the store and the server on a PostgreSQL of their own
	@scripts/machine rust
	scripts/with-postgres scripts/check-postgres

.PHONY: format
format: $(INSTALLED) ## Lays out Rust and the page's scripts and styles as the checks want them
	@scripts/machine rust
	cargo fmt --all
	npm --prefix static run --silent format

.PHONY: soak
soak: ## Kills, starves and fills the disk of the release build for an hour or two, and prints a table
	@scripts/machine rust
	cargo build --release --locked --bin lodestep
	LODESTEP_BINARY=$(abspath $(RELEASE)) cargo run --release --locked -p lodestep-tests --example soak

.PHONY: soak-cluster
soak-cluster: ## Lets two servers on one PostgreSQL take over from each other, killed and frozen, and prints a table
	@scripts/machine rust
	cargo build --release --locked --bin lodestep --features lodestep/cluster
	LODESTEP_BINARY=$(abspath $(RELEASE)) scripts/with-postgres cargo run --release --locked -p lodestep-tests --features lodestep-tests/cluster --example soak -- takeover kill 70

.PHONY: bench
bench: ## Times the engine and the parsers
	@scripts/machine rust
	cargo bench --locked -p lodestep-engine

.PHONY: instructions
instructions: ## Counts the engine's instructions per sample under callgrind
	@scripts/machine rust
	@scripts/instructions

.PHONY: docs
docs: ## Works out the pages of figures in docs again
	@scripts/machine rust
	cargo build --release --locked --bin lodestep
	@scripts/figures $(RELEASE) $(RECORDINGS)

.PHONY: screenshot
screenshot: vendor ## Takes the pictures of every screen from a running demo
	cargo build --release --locked --bin lodestep
	@scripts/with-demo $(RELEASE) npm --prefix static run --silent screenshot

.PHONY: fuzz
fuzz: ## Fuzzes every parser: make fuzz RUNS=100000000
	@scripts/machine rust
	@scripts/machine fuzz
	@scripts/fuzz $(RUNS)

.PHONY: api-check
api-check: ## Asks every route all kinds of nonsense: make api-check CASES=50000
	@scripts/machine rust
	@scripts/machine schemathesis
	cargo build --locked --bin lodestep
	@scripts/api-check $(TARGET)/debug/lodestep $(CASES)

.PHONY: audit
audit: ## Looks the dependencies up in the list of known faults (cargo-deny)
	@scripts/machine deny
	cargo deny --workspace --locked check
