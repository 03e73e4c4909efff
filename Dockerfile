# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# The programs, from their Debian package:
#
#   docker build -t vlp .
#   docker run --rm -v "$PWD:/data" vlp vlp-calibrate SESSION -o RESULTS
FROM debian:13 AS build
COPY . /vlp
WORKDIR /vlp
RUN scripts/setup.sh --build && scripts/packages.sh -o /packages tools

FROM debian:13
COPY --from=build /packages /packages
RUN apt-get update && apt-get install --yes --no-install-recommends /packages/*.deb && \
    rm -rf /packages /var/lib/apt/lists/*
WORKDIR /data
