# Every target sets up what it needs first (scripts/setup.sh says what it does) and works without a network from then on.

SHELL := /bin/sh
# Where rustup puts cargo, should the shell not know.
export PATH := $(HOME)/.cargo/bin:$(PATH)

CARGO := CARGO_NET_OFFLINE=true cargo

.PHONY: help demo test bench

help:
	@echo "make demo    the sample materials as plots, tables and rendered pictures, into the folder demo; a made-up shoot captured, where OpenCV is"
	@echo "make test    import circles, format, lints, links in the documentation and all tests"
	@echo "make bench   benchmarks: CPU and wall seconds"

demo:
	@scripts/setup.sh
	@capture=; \
	if scripts/setup.sh capture; then capture="--features capture"; else echo "without biscale capture: OpenCV cannot be installed here" >&2; fi; \
	$(CARGO) build --release --locked --package biscale-cli $$capture && \
	{ [ -z "$$capture" ] || $(CARGO) run --release --locked --package biscale-capture --example shoot -- target/demo-shoot; } && \
	scripts/demo.sh target/release/biscale demo $${capture:+target/demo-shoot}

test:
	@scripts/setup.sh test
	scripts/structure.py --check
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked --features biscale-cli/capture -- -D warnings
	RUSTDOCFLAGS="-D warnings -A rustdoc::private-intra-doc-links" $(CARGO) doc --workspace --no-deps --document-private-items --locked --features biscale-cli/capture
	$(CARGO) test --workspace --locked --features biscale-cli/capture

bench:
	@scripts/setup.sh
	$(CARGO) bench --workspace --locked
