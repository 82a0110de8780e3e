"""``cqos serve``: the gRPC service."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, TypeAlias

import click

from cqos_core.cli.errors import WrongUsageError
from cqos_core.cli.help import usual
from cqos_core.cli.parameters import CONFIG, debug_option, nearest, no_config_option
from cqos_core.service.settings import Limits, Settings, read_tokens, refuse_short, token_sum

_Decorator: TypeAlias = "Callable[[Callable[..., Any]], Callable[..., Any]]"
_DEFAULTS: Final = Settings()
_LIMITS: Final = _DEFAULTS.limits
_PREFIX: Final = "CQOS_SERVE"
_TOKEN: Final = f"{_PREFIX}_TOKEN"
_PROCESSES: Final = click.IntRange(1, 256)

_FILES: Final = frozenset({"token_file", "tls_cert", "tls_key", "tls_client_ca", "pack"})


def _configured(ctx: click.Context, _parameter: click.Parameter, value: str | None) -> str | None:
    """Set defaults of the other options from ``[serve]`` of the configuration."""
    # It comes with the forms of the YAML importer, which `--help` does not need.
    from cqos_core.config import config_for, load_config
    from cqos_core.language.domains import Names

    if ctx.resilient_parsing or ctx.params.get("no_config"):
        return value
    config = config_for(".") if value is None else load_config(value)
    options = {param.opts[0].removeprefix("--").replace("-", "_"): param for param in ctx.command.params if param.opts}
    for name in ("config", "no_config", "help", "debug"):
        options.pop(name, None)
    defaults: dict[str, Any] = {}
    for name, setting in config.serve.items():
        option, at = options.get(name), setting.place or config.path
        if option is None or option.name is None:
            raise WrongUsageError(f"{at}: `cqos serve` has no option `{name}`", nearest(name, options), ctx)
        folder = Path(setting.place.source).parent if name in _FILES and setting.place is not None else None
        texts = Names().parse(setting.text) if option.multiple else (setting.text,)
        beside = tuple(text if folder is None else str(folder / text) for text in texts)
        defaults[option.name] = beside if option.multiple else beside[0]
        try:
            option.type_cast_value(ctx, defaults[option.name])
        except click.BadParameter as error:
            raise WrongUsageError(f"{at}: `{name}`: {error.message}", getattr(error, "help", ""), ctx) from None
    ctx.default_map = defaults
    return value


def _number(name: str, kind: Any, default: float | None, text: str | None) -> _Decorator:
    """Return an option for a number; help shows its default."""
    return click.option(name, type=kind, default=default, show_default=default is not None, help=text)


@click.command(
    epilog="Exit codes: 0 ended by a signal; 2 wrong usage, or an address that cannot be opened; 3 internal error.",
    context_settings={"auto_envvar_prefix": _PREFIX},
)
@usual(
    "--listen",
    "--web",
    "--modeler",
    "--token-file",
    "--tls-cert",
    "--tls-key",
    "--allow-anonymous",
    "--workers",
    "--config",
)
@no_config_option
@click.option(
    "--config",
    "config_file",
    metavar="FILE",
    is_eager=True,
    callback=_configured,
    help=CONFIG,
)
@click.option(
    "--listen",
    metavar="HOST:PORT",
    default=_DEFAULTS.listen,
    show_default=True,
    help="Address of gRPC; port 0 takes a free one.",
)
@click.option(
    "--web", metavar="HOST:PORT", help="Serve browsers there, by Connect and gRPC-Web. Needs the extra `web`."
)
@click.option("--modeler", is_flag=True, help="Serve the page of the modeler there, too.")
@click.option(
    "--origin",
    "origins",
    metavar="URL",
    multiple=True,
    envvar=f"{_PREFIX}_ORIGIN",
    help="Pages of this origin may call the server for browsers, for instance https://example.org. Can be repeated.",
)
@click.option(
    "--token-file",
    metavar="FILE",
    help="Accept callers with a bearer token of FILE: one token a line, optionally with name=NAME share=PART after it.",
)
@click.option("--tls-cert", metavar="FILE", help="Certificate chain of the service, PEM; callers must then use TLS.")
@click.option("--tls-key", metavar="FILE", help="Private key of the certificate, PEM.")
@click.option(
    "--tls-client-ca",
    metavar="FILE",
    help="Accept callers with a certificate that one of these CA certificates signed, PEM.",
)
@click.option("--allow-anonymous", is_flag=True, help="Serve other machines without asking for credentials.")
@_number("--workers", _PROCESSES, _DEFAULTS.processes, "How many processes serve; they share the port.")
@_number(
    "--heavy-workers",
    _PROCESSES,
    _LIMITS.workers,
    "How many processes each of them has for documents and large models, so that these block no other call.",
)
@_number(
    "--session-workers", _PROCESSES, _LIMITS.session_workers, "How many processes each of them has for edit sessions."
)
@_number("--max-message-bytes", click.IntRange(1024, 1 << 30), _LIMITS.message_bytes, "The most bytes of one message.")
@_number(
    "--max-total-bytes",
    click.IntRange(1024),
    None,
    "The most bytes of all requests under way together.  [default: 16 times --max-message-bytes]",
)
@_number("--max-endpoints", click.IntRange(1), _LIMITS.endpoints, "The most endpoints of one system.")
@_number("--max-seconds", click.FloatRange(0.01), _LIMITS.seconds, "The longest time for one answer.")
@_number("--max-calls", click.IntRange(1), _LIMITS.calls, "The most calls at the same time.")
@_number("--max-sessions", click.IntRange(0), _LIMITS.sessions, "The most sessions open at the same time.")
@_number(
    "--max-share",
    click.FloatRange(0, 1),
    _LIMITS.share,
    "The largest part of the calls, their bytes and the sessions that one caller may have; the service identifies callers by token, certificate or "
    "address.",
)
@_number(
    "--max-idle-seconds",
    click.FloatRange(0.1),
    _LIMITS.idle_seconds,
    "The time after which the service closes a session without edits.",
)
@_number(
    "--max-worker-memory",
    click.IntRange(0),
    _LIMITS.worker_memory,
    "The most memory of a worker in bytes, on Linux; 0 is no limit.",
)
@_number(
    "--inline-bytes", click.IntRange(0), _LIMITS.inline_bytes, "Requests up to this size are answered without a worker."
)
@_number("--grace", click.FloatRange(0), _DEFAULTS.grace, "Seconds that calls under way get at the end.")
@_number(
    "--leaving",
    click.FloatRange(0),
    _DEFAULTS.leaving,
    "Seconds before that in which calls are still taken, while health says that it ends.",
)
@click.option("--metrics", metavar="HOST:PORT", help="Serve Prometheus metrics there. Needs the extra `metrics`.")
@click.option("--tracing", is_flag=True, help="Send spans as the variables OTEL_* say. Needs the extra `otel`.")
@click.option(
    "--log-level",
    type=click.Choice(["debug", "info", "warning", "error"]),
    default=_DEFAULTS.log_level,
    show_default=True,
    help="At info, each call is one line.",
)
@click.option(
    "--log-format",
    type=click.Choice(["json", "text"]),
    default=_DEFAULTS.log_format,
    show_default=True,
    help="Of the log on standard error.",
)
@click.option(
    "--pack",
    "pack_files",
    metavar="FILE",
    multiple=True,
    envvar=f"{_PREFIX}_PACK",
    help="A rule pack written as a YAML file, beside the installed ones. Can be repeated.",
)
@debug_option
def serve(pack_files: tuple[str, ...], **given: Any) -> None:
    """Serve checks by gRPC: to modelers while a person draws, to CI jobs, to `cqos check --server`.

    Every option can also be given as a variable, CQOS_SERVE_LISTEN for --listen, and in [serve] of cqos.toml, as
    `listen`; a flag wins over a variable, a variable over the file. A token may be in the variable CQOS_SERVE_TOKEN.
    SIGTERM ends it: calls under way are answered, new ones are not taken.

    \b
    Examples:
      cqos serve
      cqos serve --listen 127.0.0.1:0 --web 127.0.0.1:8080
      cqos serve --listen 0.0.0.0:50051 --tls-cert cert.pem --tls-key key.pem --token-file tokens
    """  # noqa: D301 - \b is click's mark for lines that are not to be wrapped
    from cqos_core.cli.pack_files import install_packs
    from cqos_core.service.server_process import serve as run

    install_packs(pack_files)
    run(settings_from(given, os.environ.get(_TOKEN)))


_RENAMED: Final = {
    "tls_cert": "certificate",
    "tls_key": "key",
    "tls_client_ca": "client_authority",
    "allow_anonymous": "anonymous",
    "workers": "processes",
}
_RENAMED_LIMITS: Final = {
    "heavy_workers": "workers",
    "max_message_bytes": "message_bytes",
    "max_total_bytes": "total_bytes",
    "max_endpoints": "endpoints",
    "max_seconds": "seconds",
    "max_calls": "calls",
    "max_sessions": "sessions",
    "max_share": "share",
    "max_idle_seconds": "idle_seconds",
    "max_worker_memory": "worker_memory",
}


def settings_from(given: dict[str, Any], token: str | None) -> Settings:
    """Return the settings for the values of the options."""
    # Click gives options in the order of the command line: `--workers` must not take the name of `--heavy-workers`.
    limits = {_RENAMED_LIMITS.get(name, name): value for name, value in given.items() if name not in _RENAMED}
    others = {_RENAMED.get(name, name): value for name, value in given.items()}
    quotas = () if given["token_file"] is None else read_tokens(given["token_file"], given["max_share"])
    tokens = tuple(each[0] for each in quotas)
    if token:
        refuse_short([token])
        tokens = (*tokens, token_sum(token))
    return Settings(
        **{each.name: others[each.name] for each in fields(Settings) if each.name in others and each.name != "tokens"},
        tokens=tokens,
        quotas=quotas,
        limits=Limits(**{each.name: limits[each.name] for each in fields(Limits) if each.name in limits}),
    )
