# Every target sets up what it needs first (scripts/setup.sh says what it does) and works without a network from then on.

SHELL := /bin/sh
# Where rustup puts cargo, should the shell not know.
export PATH := $(HOME)/.cargo/bin:$(PATH)

CARGO := CARGO_NET_OFFLINE=true cargo

.PHONY: help demo test bench

help:
	@echo "make demo    the sample materials as plots, tables and rendered pictures, into the folder demo"
	@echo "make test    format, lints and all tests"
	@echo "make bench   benchmarks: CPU and wall seconds"

demo:
	@scripts/setup.sh
	$(CARGO) build --release --locked --package biscale-cli
	scripts/demo.sh target/release/biscale demo

test:
	@scripts/setup.sh test
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked -- -D warnings
	$(CARGO) test --workspace --locked

bench:
	@scripts/setup.sh
	$(CARGO) bench --workspace --locked
