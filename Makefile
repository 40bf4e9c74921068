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
	@# One build for the command and the example that makes the shoot: two would compile what they share twice, with other features.
	@if scripts/setup.sh capture; then \
		$(CARGO) build --release --locked --package biscale-cli --package biscale-capture --features biscale-cli/capture --bin biscale --example shoot && \
		target/release/examples/shoot target/demo-shoot && \
		scripts/demo.sh target/release/biscale demo target/demo-shoot; \
	else \
		echo "without biscale capture: OpenCV cannot be installed here" >&2; \
		$(CARGO) build --release --locked --package biscale-cli && scripts/demo.sh target/release/biscale demo; \
	fi
	@echo "--- the command: $(CURDIR)/target/release/biscale (cargo install --locked --path cli puts it on the path)"

test:
	@scripts/setup.sh test
	scripts/structure.py --check
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --all-targets --locked --features biscale-cli/capture -- -D warnings
	$(CARGO) clippy --package biscale-cli --locked -- -D warnings
	RUSTDOCFLAGS="-D warnings -A rustdoc::private-intra-doc-links" $(CARGO) doc --workspace --no-deps --document-private-items --locked --features biscale-cli/capture
	$(CARGO) test --workspace --locked --features biscale-cli/capture

bench:
	@scripts/setup.sh
	$(CARGO) bench --workspace --locked
